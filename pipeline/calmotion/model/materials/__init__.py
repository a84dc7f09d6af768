"""What flexible bodies are made of."""
