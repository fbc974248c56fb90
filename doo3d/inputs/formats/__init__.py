"""Read the capture formats: one file per reader that `inputs.FORMATS` names."""
