"""How the tests are run: threads, cost, fuzzing, what workers share."""
