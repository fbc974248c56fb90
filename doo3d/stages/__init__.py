"""The stages of the method: one file each, one public function `stage(data, config) -> data`."""
