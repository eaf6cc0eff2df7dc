"""The controller of a campaign as FMU: its reference, feed-forward and cascades, sampled, in C."""
