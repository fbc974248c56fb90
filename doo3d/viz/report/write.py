"""Write a run as one HTML page: the function `doo3d.report`, as the command `doo3d report`."""

from dataclasses import replace
from os import PathLike
from pathlib import Path

from ...errors import options_of_python
from ...outputs.new_file import check_new_file, named_after, save
from ...outputs.products import Products
from ...outputs.run_reader import Results, open_results
from ...types.arguments import file_path, flag, probability
from .page import report_page


def report(
    results: Results | str | PathLike[str],
    out: str | PathLike[str] | None = None,
    *,
    clouds: bool = True,
    min_confidence: float = 0.0,
    force: bool = False,
) -> Path:
    """Write a run as one HTML page: figures, plots, pictures, and the chains of each frame in 3-D.

    The page is a single file that opens without a network.

    Parameters
    ----------
    results
        the folder that `run` or `doo3d detect` wrote, or its Results.
    out
        the HTML file to write; None for a file next to the folder with the folder's name.
    clouds
        show points of the capture around the chains, if it can still be read.
    min_confidence
        confidence, 0 to 1, below which objects are left out.
    force
        True replaces an existing file.

    Returns
    -------
    The file written.

    Raises
    ------
    InputError : the results are missing, unfinished or damaged, or the file exists or cannot be written.
    """
    with options_of_python():
        least = probability(min_confidence, "min_confidence")
        opened = results if isinstance(results, Results) else open_results(file_path(results, "results"))
        opened = replace(opened, min_confidence=max(opened.min_confidence, least))
        file = named_after(opened.path, ".html") if out is None else file_path(out, "out")
        check_new_file(file, flag(force, "force"), opened.path)
        save(file, report_page(opened, file.absolute().parent, flag(clouds, "clouds")))
        Products(opened.path).add([file])
    return file
