"""What the simulation gets wrong: found, named, mended, and the gain measured.

A step lends its regression (steps.Diagnosable). The causes that its model can take are linearised beside its own
unknowns in one pass (workbench, sheet), tested together (scores, detect), tried one by one as the whole answer
(naming), and judged (verdict). The answer extends the step's model: its estimate is made again with the cause in.
"""
