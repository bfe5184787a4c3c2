"""Print what lets a shell complete commands, options and files: eval "$(petcontact completion)"

The line above belongs into ~/.bashrc, for zsh into ~/.zshrc.
"""

from __future__ import annotations

import argparse

from .options import option, options

add_arguments = options(
    option("shell", nargs="?", choices=("bash", "zsh"), default="bash", help="default: bash"),
)
"""The options of `petcontact completion`."""
SCRIPT = """
_petcontact() {
    local word=${COMP_WORDS[COMP_CWORD]} command=${COMP_WORDS[1]} words
    if ((COMP_CWORD == 1)); then
        words='@COMMANDS'
    elif [[ $word == -* ]]; then
        words=$(petcontact "$command" --help 2>/dev/null | grep -oE -- '--[a-z][a-z-]+' | sort -u)
    elif [[ ${COMP_WORDS[COMP_CWORD-1]} == --kind ]]; then
        words='@KINDS'
    elif [[ $command == help ]]; then
        words='@CHAPTERS'
    fi
    COMPREPLY=($(compgen -W "$words" -- "$word"))
}
complete -o default -F _petcontact petcontact
"""
"""For bash; files are completed where no word fits."""


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """Print; needs no PETSc."""
    from ..manual import topics
    from .init import KINDS
    from .parsers import COMMANDS

    script = SCRIPT
    for name, words in (("COMMANDS", COMMANDS), ("KINDS", KINDS), ("CHAPTERS", topics())):
        script = script.replace(f"@{name}", " ".join(words))
    start = "autoload -U +X bashcompinit && bashcompinit\n" if arguments.shell == "zsh" else ""
    print(start + script, end="")
    return 0
