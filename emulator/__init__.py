"""Behind the connector: the prototype in a physics engine, its drives and encoders, and their firmware."""
