"""Our schemas must be known before any test of this process opens a stage."""

from calmotion.usd import schemas

schemas.register()
