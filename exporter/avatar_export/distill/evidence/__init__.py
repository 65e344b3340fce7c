"""What the numbers of dumps say of themselves: conventions, units, frames that belong together."""
