"""Replays the frames of CiA's conformance tool against a node on a bus."""
