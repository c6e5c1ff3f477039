"""usage: packaging_test.py BAUDGATE PAGES SOURCE"""
# SPDX-License-Identifier: Apache-2.0
import os
import pathlib
import re
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
            self.assertTrue((top / "LICENSE").exists())

    def test_links_in_the_sources_hold(self):
        for page in [*SOURCE.glob("*.md"), *SOURCE.glob("docs/**/*.md"), *SOURCE.glob("protocols/**/*.md")]:
            for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
                if "://" not in target:
                    self.assertTrue((page.parent / target).exists(), f"{page}: {target}")


class OneVersionTest(unittest.TestCase):
    def test_the_page_says_the_version_of_the_program(self):
        version = output(BAUDGATE, "--version").stdout.split()[1]
        self.assertIn(f'"baudgate {version}"', (PAGES / "baudgate.1").read_text())


if __name__ == "__main__":
    BAUDGATE, PAGES, SOURCE = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    unittest.main(argv=sys.argv[:1])
