"""One comparison of all that may be there: the posterior over sets of hypotheses, for the rows of any problem."""
