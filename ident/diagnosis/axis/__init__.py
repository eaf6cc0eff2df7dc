"""Diagnosis of a servo axis, or of several coupled ones."""
