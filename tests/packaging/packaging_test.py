"""usage: packaging_test.py BAUDGATE PAGES SOURCE"""
# SPDX-License-Identifier: Apache-2.0
import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest


def output(*words, **more):
    return subprocess.run(words, capture_output=True, text=True, check=False, **more)


def subcommands():
    """As the program itself names them when a word is none of them."""
    return re.search(r"there are: (.*)", output(BAUDGATE, "nonsense").stderr).group(1).split(", ")


def completed(*words):
    """What bash offers for the last word."""
    script = 'source "$0"; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _baudgate; printf "%s\n" "${COMPREPLY[@]}"'
    path = os.pathsep.join([os.path.dirname(BAUDGATE), os.environ["PATH"]])
    return output("bash", "-c", script, str(PAGES / "baudgate.bash"), *words, env={**os.environ, "PATH": path}).stdout.split()


class PagesTest(unittest.TestCase):
    def test_every_subcommand_is_in_page_and_completions(self):
        self.assertIn("simulate", subcommands())
        page = (PAGES / "baudgate.1").read_text().replace("\\-", "-")
        zsh = (PAGES / "_baudgate").read_text()
        fish = (PAGES / "baudgate.fish").read_text()
        self.assertEqual(sorted(set(subcommands()) - set(completed("baudgate", ""))), [])
        for name in subcommands():
            self.assertRegex(page, rf"\n\.SS \\fBbaudgate {name}\b")
            self.assertIn(f"_baudgate_{name.replace('-', '_')}() {{", zsh)
            self.assertRegex(zsh, rf"\n        '{name}:")
            self.assertRegex(fish, rf" -a {name} -d ")

    def test_bash_completes_options_nested_subcommands_and_names(self):
        self.assertEqual(completed("baudgate", "sim"), ["simulate"])
        self.assertIn("--confirm", completed("baudgate", "settings", "restore", "--"))
        self.assertEqual(sorted(completed("baudgate", "settings", "")[:3]), ["compare", "dump", "restore"])
        self.assertEqual(completed("baudgate", "simulate", "--profile", "spaj"), ["spaj140c"])
        self.assertIn("dcon", completed("baudgate", "decode", "--protocol", ""))

    def test_every_help_begins_with_an_example(self):
        for name in subcommands():
            if name != "watch":  # baudgate-dds prints its help, and is not always built
                self.assertRegex(output(BAUDGATE, name, "--help").stdout, rf"(?m)^Example: baudgate {name}\b")

    def test_every_option_of_a_subcommand_is_in_page_and_completions(self):
        text = output(BAUDGATE, "trace", "--help").stdout
        options = set(re.findall(r"^  (?:-\w,)?(--[a-z-]+)", text, re.MULTILINE)) | {"--help"}
        self.assertIn("--last", options)
        self.assertEqual(options - set(completed("baudgate", "trace", "-")), set())


class DocumentsTest(unittest.TestCase):
    def test_links_between_installed_documents_hold(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([sys.executable, str(SOURCE / "packaging/docs.py"), folder], check=True)
            top = pathlib.Path(folder)
            links = 0
            for page in top.rglob("*.md"):
                for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
                    if "://" not in target:
                        links += 1
                        self.assertTrue((page.parent / target).exists(), f"{page.relative_to(top)}: {target}")
            self.assertGreater(links, 50)
            for name in ["LICENSE", "SECURITY.md", "docs/vex.json"]:
                self.assertTrue((top / name).exists(), name)

    def test_links_in_the_sources_hold(self):
        for page in [*SOURCE.glob("*.md"), *SOURCE.glob("docs/**/*.md"), *SOURCE.glob("protocols/**/*.md")]:
            for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
                if "://" not in target:
                    self.assertTrue((page.parent / target).exists(), f"{page}: {target}")


class ContentsTest(unittest.TestCase):
    """The SBOM: packaging/sbom.py."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()  # pylint: disable=consider-using-with
        self.addCleanup(folder.cleanup)
        self.top = pathlib.Path(folder.name)
        self.program = self.top / "tree/usr/bin/baudgate"
        self.program.parent.mkdir(parents=True)
        shutil.copy(BAUDGATE, self.program)
        (self.program.parent / "script").write_text("#!/bin/sh\n")

    def sbom(self, *words, **environment):
        return output(sys.executable, str(SOURCE / "packaging/sbom.py"), *words, env={**os.environ, **environment})

    def test_programs_have_hashes_and_the_text_is_always_the_same(self):
        words = ["baudgate", "1.0+2", "1000000000", str(self.top / "tree")]
        first = self.sbom(*words)
        self.assertEqual(first.returncode, 0, first.stderr)
        self.assertEqual(self.sbom(*words, TZ="Pacific/Kiritimati", LC_ALL="C").stdout, first.stdout)
        made = json.loads(first.stdout)
        self.assertEqual([each["fileName"] for each in made["files"]], ["./usr/bin/baudgate"])
        hashes = {each["algorithm"]: each["checksumValue"] for each in made["files"][0]["checksums"]}
        self.assertEqual(hashes["SHA256"], hashlib.sha256(self.program.read_bytes()).hexdigest())
        self.assertIn("SHA1", hashes)  # SPDX 2.3 requires it
        known = {each["SPDXID"] for each in made["files"] + made["packages"]}
        self.assertEqual({each["relatedSpdxElement"] for each in made["relationships"]}, known)

        path = self.top / "made.json"
        path.write_text(first.stdout)
        self.assertEqual(self.sbom("--verify", str(path), words[3]).returncode, 0)
        with self.program.open("ab") as program:
            program.write(b"x")
        changed = self.sbom("--verify", str(path), words[3])
        self.assertEqual((changed.returncode, changed.stderr), (1, "./usr/bin/baudgate: its hash differs\n"))


class VexTest(unittest.TestCase):
    """docs/vex.json has the form of OpenVEX 0.2.0, and each test that it names exists."""
    JUSTIFICATIONS = {"component_not_present", "vulnerable_code_not_present", "vulnerable_code_not_in_execute_path",
                      "vulnerable_code_cannot_be_controlled_by_adversary", "inline_mitigations_already_exist"}

    def setUp(self):
        self.vex = json.loads((SOURCE / "docs/vex.json").read_text(encoding="utf-8"))

    def test_form(self):
        self.assertEqual(self.vex["@context"], "https://openvex.dev/ns/v0.2.0")
        self.assertLessEqual({"@id", "author", "timestamp", "version", "statements"}, self.vex.keys())
        names = [each["vulnerability"]["name"] for each in self.vex["statements"]]
        self.assertEqual(len(names), len(set(names)))
        for name, each in zip(names, self.vex["statements"]):
            self.assertRegex(name, r"^CVE-\d{4}-\d{4,}$")
            self.assertIn(each["status"], {"not_affected", "affected", "fixed", "under_investigation"}, name)
            self.assertEqual(each.get("justification") in self.JUSTIFICATIONS, each["status"] == "not_affected", name)
            self.assertEqual("action_statement" in each, each["status"] == "affected", name)
            for product in each["products"]:
                self.assertRegex(product["@id"], r"^pkg:deb/baudgate/baudgate(-dds)?$")
                for part in product["subcomponents"]:
                    self.assertRegex(part["@id"], r"^pkg:deb/debian/[a-z0-9.]+@[^+]+$")

    def test_named_tests_exist_and_unused_functions_are_unused(self):
        notes = " ".join(each["status_notes"] for each in self.vex["statements"])
        tests = [(path, name) for path, names in re.findall(r"(tests/\S+\.cpp) (\w+(?:, \w+(?![/\w]))*)", notes) for name in names.split(", ")]
        self.assertGreater(len(tests), 10)
        for path, name in tests:
            self.assertRegex((SOURCE / path).read_text(encoding="utf-8"), rf"\b{name}\b")
        unused = re.findall(r"does not call (\w+)", notes)
        self.assertEqual(len(unused), 2)
        for path in [path for layer in ["gateway", "protocols", "transports"] for path in (SOURCE / layer).rglob("*.cpp")]:
            text = path.read_text(encoding="utf-8")
            self.assertFalse([name for name in unused if name + "(" in text], path)


class OneVersionTest(unittest.TestCase):
    def test_the_page_says_the_version_of_the_program(self):
        version = output(BAUDGATE, "--version").stdout.split()[1]
        self.assertIn(f'"baudgate {version}"', (PAGES / "baudgate.1").read_text())


if __name__ == "__main__":
    BAUDGATE, PAGES, SOURCE = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    unittest.main(argv=sys.argv[:1])
