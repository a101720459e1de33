"""The multiharmonic balance: problems, their residual and Jacobian, scales, checks and first points."""
