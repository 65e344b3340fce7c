"""What captures are read from: own layout, metrical-tracker / INSTA, IMavatar; CAPTURE.md describes them."""
