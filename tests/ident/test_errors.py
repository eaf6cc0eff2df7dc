from __future__ import annotations

import pickle

from ident.campaign.controller import FollowingError
from ident.errors import RecordError


def test_an_error_comes_out_of_a_workers_process_as_it_went_in() -> None:
    for error in (RecordError("This is wrong.", "Mend it."), FollowingError("x", 7, 0.2, 0.1)):
        again = pickle.loads(pickle.dumps(error))
        assert type(again) is type(error)
        assert (str(again), again.what, again.remedy) == (str(error), error.what, error.remedy)
