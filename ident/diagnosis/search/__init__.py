"""The search for the set with the largest posterior, and what may stand in its places."""
