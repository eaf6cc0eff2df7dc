"""Hardware in the loop under pytest: fixtures of a bench, expectations in simulated time, pictures of failures.

Nothing is imported here: pytest loads the plugin in every project, and only a test that asks for a bench pays for it.
"""
