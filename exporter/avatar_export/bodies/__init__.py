"""FLAME and SMPL: body models, identities, tracked poses, and the rigs baked from them."""
