"""A case opens nothing outside its folder, whatever links lie in it."""

import pytest

from bayes_placement.io import case
from tests.io.case.test_folder import written


@pytest.mark.parametrize("name", ["case.json", "measured.uff"])
def test_a_link_that_leads_out_of_a_case_is_refused(tmp_path, name):
    folder, outside = tmp_path / "case", tmp_path / name
    folder.mkdir()
    (written(folder) / name).rename(outside)
    (folder / name).symlink_to(outside)
    with pytest.raises(case.CaseError, match=rf"{name} is a link to .*, which is outside"):
        case.read(folder)


def test_a_link_to_itself_is_no_file(tmp_path):
    (tmp_path / "case.json").symlink_to("case.json")
    with pytest.raises((case.CaseError, OSError), match=r"case\.json"):
        case.read(tmp_path)


def test_a_link_within_a_case_is_followed(tmp_path):
    folder = tmp_path / "case"
    folder.mkdir()
    (written(folder) / "measured.uff").rename(folder / "bar.uff")
    (folder / "measured.uff").symlink_to("bar.uff")
    (tmp_path / "other").symlink_to(folder)
    assert case.read(tmp_path / "other").measurement is not None
