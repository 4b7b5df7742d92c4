"""How much better the extended model predicts data that were held out."""
