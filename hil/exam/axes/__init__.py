"""An exam of servo axes: machines drawn at random, a record to fit and one to confirm, neither with repeats."""
