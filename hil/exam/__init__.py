"""The withheld exam of the gap diagnosis: sealing, diagnosing, scoring."""
