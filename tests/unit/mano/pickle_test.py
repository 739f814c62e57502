"""mano-pickle-to-npz and `embodyctl import-mano` on pickles of a synthetic model.

Usage: pickle_test.py CONVERTER EMBODYCTL

The pickles are written as Python 2 with chumpy and SciPy would: stand-in classes under those modules' names. Exit code
77: skipped.
"""
import json
import os
import pickle
import struct
import subprocess
import sys
import tempfile
import types
import unittest

try:
    import numpy
except ImportError:
    print("skipped: NumPy is not installed (Debian: python3-numpy)")
    sys.exit(77)

CONVERTER, EMBODYCTL = sys.argv[1], sys.argv[2]
TIPS = (744, 320, 443, 554, 671)


def stand_in(module, name):
    """A class that pickles as module.name."""
    parts = module.split(".")
    for i in range(len(parts)):
        sys.modules.setdefault(".".join(parts[: i + 1]), types.ModuleType(".".join(parts[: i + 1])))
    kind = type(name, (object,), {"__module__": module})
    setattr(sys.modules[module], name, kind)
    return kind


Ch = stand_in("chumpy.ch", "Ch")
Select = stand_in("chumpy.reordering", "Select")
csc_matrix = stand_in("scipy.sparse.csc", "csc_matrix")


def with_state(kind, **state):
    value = kind()
    value.__dict__.update(state)
    return value


def synthetic_model(seed=61):
    random = numpy.random.RandomState(seed)
    v_template = random.uniform(-0.01, 0.01, (778, 3))
    v_template[:, 0] += numpy.linspace(0.1, -0.05, 16)[numpy.arange(778) % 16]
    for vertex in TIPS:
        v_template[vertex] = (-0.09, 0.0, 0.0)
    regressor = numpy.zeros((16, 778))
    for vertex in range(480):
        regressor[vertex % 16, vertex] = 1.0 / 30.0
    weights = random.uniform(0.0, 1.0, (778, 16))
    parents = [2**32 - 1, 0, 1, 2, 0, 4, 5, 0, 7, 8, 0, 10, 11, 0, 13, 14]
    return {
        "v_template": v_template,
        "f": random.randint(0, 778, (1538, 3)).astype("u4"),
        "J_regressor": regressor,
        "kintree_table": numpy.array([parents, range(16)], dtype="i8"),
        "weights": weights / weights.sum(axis=1, keepdims=True),
        "posedirs": random.uniform(-0.01, 0.01, (778, 3, 135)),
        "shapedirs": random.uniform(-0.01, 0.01, (778, 3, 10)),
    }


def as_published(model):
    """The containers of the original: Fortran order, sparse regressor, chumpy objects, keys that nobody needs."""
    rows, columns = [], [0]
    data = []
    for column in model["J_regressor"].T:
        for row in numpy.flatnonzero(column):
            rows.append(row)
            data.append(column[row])
        columns.append(len(rows))
    sparse = with_state(csc_matrix, data=numpy.array(data), indices=numpy.array(rows, "i4"),
                        indptr=numpy.array(columns, "i4"), _shape=(16, 778), format="csc", maxprint=50)
    inner = with_state(Ch, x=numpy.concatenate([model["shapedirs"].ravel(), [9.0, 9.0]]), _dirty_vars=set(["x"]), _itr=None)
    shapes = with_state(Select, a=inner, idxs=numpy.arange(778 * 30), preferred_shape=(778, 3, 10), _dirty_vars=set())
    return dict(model, J_regressor=sparse, shapedirs=shapes, posedirs=numpy.asfortranarray(model["posedirs"]),
                bs_style="lbs", hands_mean=numpy.zeros(45))


class Hostile:
    def __init__(self, call, *arguments):
        self.call, self.arguments = call, arguments

    def __reduce__(self):
        return self.call, self.arguments


class PickleTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def run_program(self, *command):
        return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)

    def convert(self, content, protocol=2, *options):
        with open(self.path("hand.pkl"), "wb") as file:
            file.write(content if isinstance(content, bytes) else pickle.dumps(content, protocol))
        return self.run_program(sys.executable, CONVERTER, self.path("hand.pkl"), self.path("hand.npz"), *options)

    def test_a_published_pickle_arrives_in_the_products_own_file_number_by_number(self):
        model = synthetic_model()
        for protocol in (0, 1, 2, 4):
            with self.subTest(protocol=protocol):
                done = self.convert(as_published(model), protocol, "--force")
                self.assertEqual(done.returncode, 0, done.stderr)
                done = self.run_program(EMBODYCTL, "import-mano", self.path("hand.npz"), "--output",
                                        self.path("hand.json"), "--json", "--force")
                self.assertEqual(done.returncode, 0, done.stderr + done.stdout)
                self.assertEqual(json.loads(done.stdout)["result"]["side"], "right")
                with open(self.path("hand.json"), encoding="ascii") as file:
                    result = json.load(file)
                for key in ("v_template", "f", "posedirs", "shapedirs"):
                    numpy.testing.assert_array_equal(numpy.array(result[key]), model[key], key)
                numpy.testing.assert_allclose(result["weights"], model["weights"], rtol=0, atol=1e-15)
                numpy.testing.assert_allclose(result["J"], model["J_regressor"] @ model["v_template"], atol=1e-14)

    def test_a_chumpy_variable_without_a_selection_is_read_too(self):
        model = synthetic_model()
        done = self.convert(dict(model, shapedirs=with_state(Ch, x=model["shapedirs"])))
        self.assertEqual(done.returncode, 0, done.stderr)
        numpy.testing.assert_array_equal(numpy.load(self.path("hand.npz"))["shapedirs"], model["shapedirs"])

    def test_an_existing_file_stays_unless_forced(self):
        with open(self.path("hand.npz"), "wb") as file:
            file.write(b"precious")
        done = self.convert(as_published(synthetic_model()))
        self.assertEqual(done.returncode, 1)
        self.assertIn("--force", done.stderr)
        self.assertEqual(os.path.getsize(self.path("hand.npz")), 8)

    def test_a_hostile_pickle_runs_nothing_whatever_it_calls(self):
        trace = self.path("trace")
        hostile = {
            "os.system": Hostile(os.system, "touch " + trace),
            "eval": Hostile(eval, f"open({trace!r}, 'w')"),
            "open": Hostile(open, trace, "w"),
            "subprocess": Hostile(subprocess.call, ["touch", trace]),
            "getattr": Hostile(getattr, "x", "upper"),
            "numpy.fromfile": Hostile(numpy.fromfile, "/etc/hostname"),
            "numpy.load": Hostile(numpy.load, "/etc/hostname"),
        }
        for name, value in hostile.items():
            for protocol in (0, 4):
                with self.subTest(call=name, protocol=protocol):
                    done = self.convert(dict(synthetic_model(), v_template=value), protocol)
                    self.assertEqual(done.returncode, 1)
                    self.assertIn("nothing was run", done.stderr)
                    self.assertFalse(os.path.exists(trace))
                    self.assertFalse(os.path.exists(self.path("hand.npz")))

    def test_a_dotted_name_does_not_reach_into_an_allowed_module(self):
        name = b"dtype.__class__.__base__.__subclasses__"
        text = b"\x80\x04\x8c\x05numpy\x8c" + struct.pack("B", len(name)) + name + b"\x93)R."
        done = self.convert(text)
        self.assertEqual(done.returncode, 1)
        self.assertIn("nothing was run", done.stderr)

    def test_damage_is_told_in_one_line_without_a_traceback(self):
        whole = pickle.dumps(as_published(synthetic_model()), 2)
        cases = [b"", b"no pickle", whole[: len(whole) // 2], pickle.dumps([1, 2, 3]), pickle.dumps({}),
                 pickle.dumps(dict(synthetic_model(), f=numpy.array(["a", "b"]))),
                 pickle.dumps(dict(synthetic_model(), f=["a", "b"])),
                 pickle.dumps(dict(synthetic_model(), J_regressor=with_state(csc_matrix, data=numpy.zeros(3),
                                                                             indptr=[float("inf")] * 17))),
                 pickle.dumps(dict(synthetic_model(), weights=numpy.array([{}, None], dtype=object))),
                 pickle.dumps(dict(synthetic_model(), J_regressor=with_state(csc_matrix, data=numpy.zeros(3)))),
                 pickle.dumps(dict(synthetic_model(), shapedirs=with_state(Select, a=numpy.zeros(3))))]
        for i, content in enumerate(cases):
            with self.subTest(case=i):
                done = self.convert(content)
                self.assertEqual(done.returncode, 1, done.stdout)
                self.assertNotIn("Traceback", done.stderr)
                self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
                self.assertFalse(os.path.exists(self.path("hand.npz")))

    def test_import_mano_sends_pickles_here(self):
        self.convert(as_published(synthetic_model()))
        done = self.run_program(EMBODYCTL, "import-mano", self.path("hand.pkl"))
        self.assertEqual(done.returncode, 1)
        self.assertIn("mano-pickle-to-npz", done.stderr)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
