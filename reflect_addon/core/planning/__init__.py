"""Which stand-in each reflector gets: candidates are tried on the rays that are seen, and the cheapest that is good enough is taken.

    goal.py        what is asked for: a tolerance and budgets
    samples.py     the rays that are seen, and what they meet
    errors.py      how far off a candidate's answers are
    candidate.py   one that is tried, and what trying it told
    candidates.py  what there is to choose among, baked coarsely without light, and tried
    choose.py      which of them each reflector gets, and why
    plan.py        what came of it, as a file
"""
