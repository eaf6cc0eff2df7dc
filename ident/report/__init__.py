"""What a person gets to see: tables in the terminal and one self-contained HTML file."""
