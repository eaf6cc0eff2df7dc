"""The diagnosis as one comparison: hypotheses of law and place, their evidence, and the answer that follows."""
