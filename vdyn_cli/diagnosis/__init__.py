"""What the simulation gets wrong: detected, named, the model extended by it, and the gain measured on held-out data.

A step lends its problem (diagnosis_setup). The candidate effects that its model can take are linearized beside its own
unknowns in one pass (full_model, linearized_system), tested together (scores, detection), refitted one by one as the
whole answer (candidate_models, model_selection), and judged (judgment). Two strategies fit them: refit, which simulates
at every step, and linearized, for models that are expensive to simulate. The answer extends the step's model: its
estimate is made again with the effect in (extension), and the outcome is one typed Diagnosis (diagnose). Every
threshold stands in ``policy`` with its reason.
"""
