"""Experiments that could be driven: what each can see, and is expected to tell."""
