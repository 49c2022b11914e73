"""Pictures of the geomagnetic field: along an orbit, over the globe, as a cone."""
