"""What people look at: summary, pictures, self-contained HTML."""
