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
_petcontact() {{
    local word=${{COMP_WORDS[COMP_CWORD]}} words
    case ${{COMP_WORDS[1]}} in
{cases}
        *) words='' ;;
    esac
    ((COMP_CWORD == 1)) && words='{commands}'
    COMPREPLY=($(compgen -W "$words" -- "$word"))
}}
complete -o default -F _petcontact petcontact
"""
"""For bash; files are completed where no word fits."""


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """Print; needs no PETSc."""
    from .main import COMMANDS, parser_of

    cases = list[str]()
    for name in COMMANDS:
        parser = parser_of(name)[1]
        words = [word for word in parser._option_string_actions if word.startswith("--")]
        words += [
            str(choice)
            for action in parser._actions
            for choice in action.choices or ()
            if name in ("init", "completion")
        ]
        if name == "help":
            from ..manual import topics

            words += topics()
        cases.append(f"        {name}) words='{' '.join(words)}' ;;")
    start = "autoload -U +X bashcompinit && bashcompinit\n" if arguments.shell == "zsh" else ""
    print(start + SCRIPT.format(cases="\n".join(cases), commands=" ".join(COMMANDS)), end="")
    return 0
