"""What things are, without solvers: the task in the stages' numbers, hands and motions; SI and back."""
