"""A recorded log through the bench: its nodes answered by the emulator, and where those answers differ from the recorded
ones.
"""
