"""Records of the platform as rows before they are evaluated: what rolls, rattles, rests, slides."""
