//! Judgement of step-size results that another code produced.
