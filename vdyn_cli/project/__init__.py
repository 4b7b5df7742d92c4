"""From a description to documents: inputs, one step, the pipeline."""
