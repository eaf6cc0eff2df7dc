"""A recorded log through the bench: its nodes are answered by the emulator; where do both answers differ?"""
