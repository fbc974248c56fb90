"""What tests share: errors by their code; curves, chains, frames, clouds, captures and bags of known truth."""
