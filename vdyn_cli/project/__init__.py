"""One description to documents: inputs, one step, the pipeline."""
