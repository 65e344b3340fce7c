"""The visitor's camera as a closed loop: known channels -> `gl` -> a fake camera -> the page's tracker -> channels."""
