"""The answer: who keeps a place, the verdict, and what is found."""
