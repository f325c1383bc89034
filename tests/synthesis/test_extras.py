# SPDX-License-Identifier: Apache-2.0
import sys

import pytest

from kintrack.errors import SceneError
from synthesis.extras import needed


def test_a_missing_package_says_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "embreex", None)
    monkeypatch.delitem(sys.modules, "embreex.rtcore_scene", raising=False)
    with pytest.raises(SceneError, match=r"kintrack\[synthesis\]"):
        needed("embreex.rtcore_scene")
