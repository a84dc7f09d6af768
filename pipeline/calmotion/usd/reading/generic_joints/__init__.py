"""Generic (D6) joints of UsdPhysics: what they leave free, and the hinges and sliders that they are made of."""
