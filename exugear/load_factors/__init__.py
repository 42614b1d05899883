"""Load distribution over the face, dynamic factors, dynamic stresses and bearing life."""
