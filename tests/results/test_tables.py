"""The files of a result for other programs to read."""

from records import case_of, recording, several

from exfit.results.tables import parameter_file
from exfit.workflows import fit


def test_the_file_of_parameters_names_every_record_with_its_error(tmp_path):
    content = several(recording("up"), recording("down"), estimate={"iterations": 1})
    found = fit(case_of(content, tmp_path))
    heading = parameter_file(found).splitlines()[0]
    for one_of in found.comparisons:
        assert f"{one_of.record}: rmse {one_of.rmse:.4g} pu" in heading
