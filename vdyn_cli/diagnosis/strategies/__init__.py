"""How candidate models are fitted: simulated at every step, or linearized."""
