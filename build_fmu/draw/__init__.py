"""Pictures of mechanisms and runs, and the frame of HTML pages."""
