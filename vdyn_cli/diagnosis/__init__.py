"""Detects and names what the simulation gets wrong, extends the model by it, and measures the held-out gain.

A step supplies its problem (diagnosis_setup). The residuals are linearized once, in the model's own unknowns and those
of all candidate effects (full_model, linearized_system). The candidates are tested together (scores, detection), each
is refitted as the only effect (candidate_models, model_selection), and the verdict follows (judgment). Two strategies
fit them: refit simulates at every step of a fit, linearized is for models that are expensive to simulate. The step's
estimate is then repeated with the named effect (extension), and the outcome is one typed Diagnosis (diagnose).
``policy`` holds every threshold with its reason.
"""
