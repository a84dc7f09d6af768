"""The explanations: each says what the sensors would show if it were the cause, and what to do about it."""
