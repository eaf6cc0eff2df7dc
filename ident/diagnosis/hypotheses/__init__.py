"""Everything that may be there: columns in the rows with a prior each, and exact forms."""
