"""One file per capture format, each a reader that `inputs.FORMATS` names."""
