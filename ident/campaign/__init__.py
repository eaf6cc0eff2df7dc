"""What is driven and how: excitation, references, controller and plan, free of bus and engine."""
