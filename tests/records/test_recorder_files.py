"""Made-up recorder's files: no suggestion is wrong without a word; the study counts all of them."""

import pytest
from recorder_files import FILES, write
from recorder_judge import MISSED, WRONG, judged

IN_SHORT = 4  # every so many of the files; the others take long


@pytest.mark.parametrize(
    "file",
    [
        pytest.param(file, marks=() if k % IN_SHORT == 0 else pytest.mark.long, id=file.name)
        for k, file in enumerate(FILES)
    ],
)
def test_a_recorder_s_file_gets_a_right_case_or_a_precise_question(file, tmp_path):
    result = judged(file, write(file, tmp_path))
    assert result.outcome not in (MISSED, WRONG), result.reasons
