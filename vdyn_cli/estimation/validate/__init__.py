"""How `validate` holds drives against the model: noise of every output, prediction band, regression, windows."""
