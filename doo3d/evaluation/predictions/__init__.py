"""Score the predictions of other programs, in neutral files, against labelled photographs and true cables."""
