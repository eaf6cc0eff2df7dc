"""Logs and records in other formats."""
