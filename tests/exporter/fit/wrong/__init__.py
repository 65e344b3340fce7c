"""Files that are readable and wrong, made of sound ones: what of them `convert` names, doubts, or cannot see."""
