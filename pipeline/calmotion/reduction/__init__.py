"""From finite elements to a reduced flexible body (`reduce.reduce_body` -> `reduced_body.ReducedBody`)."""
