"""From records to parameters with honest standard deviations (paper, section 6)."""
