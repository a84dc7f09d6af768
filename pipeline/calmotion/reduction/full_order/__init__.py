"""Full models of flexible bodies before their reduction, and which of them are alike."""
