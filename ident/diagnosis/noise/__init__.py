"""The noise of rows: its colour, and what may be lacking beside."""
