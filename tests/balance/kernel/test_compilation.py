"""What is compiled before the first run is all that it needs."""

import numpy as np
from helpers.problems import random_problem

from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import FrequencySystem
from slipstick.balance.kernel.compilation import compile_all
from slipstick.balance.kernel.sums import add_products, compliance_times
from slipstick.structure.kernel.modal_sums import modal_sums


def test_a_problem_needs_no_other_versions():
    assert compile_all() > 0.0
    functions = (modal_sums, compliance_times, add_products)
    before = [len(function.signatures) for function in functions]
    problem = random_problem(0)
    balance = Balance(problem)
    jacobian = FrequencySystem(balance, problem.inputs).evaluate(np.full(balance.size, 0.1), 3.0).jacobian
    assert not jacobian.singular
    assert [len(function.signatures) for function in functions] == before
