"""The floor: vehicle model, records, excitation, estimation. Knows neither CAN nor a physics engine."""
