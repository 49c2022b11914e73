"""Pictures of the averaged motion."""
