"""Public names of `calmotion.support`: each is imported when it is first used."""

from calmotion.support.caching.cache_folder import cache_folder as cache_folder
from calmotion.support.files import is_own as is_own
from calmotion.support.files import is_special as is_special
from calmotion.support.files import locked as locked
from calmotion.support.files import refuse_special as refuse_special
from calmotion.support.files import replaced as replaced
from calmotion.support.files import temporary_folder as temporary_folder
from calmotion.support.files import try_writing as try_writing
from calmotion.support.files import write_text as write_text
from calmotion.support.foreign_files import refuse_lfs_pointers as refuse_lfs_pointers
from calmotion.support.foreign_files import remedy_for as remedy_for
from calmotion.support.interrupts import answer as answer
from calmotion.support.interrupts import check as check
from calmotion.support.memory import available_memory as available_memory
from calmotion.support.memory import too_large as too_large
from calmotion.support.naming import distinct_names as distinct_names
from calmotion.support.naming import grouped_notes as grouped_notes
from calmotion.support.naming import nearest as nearest
from calmotion.support.reading import read_text as read_text
from calmotion.support.reading import read_toml as read_toml
from calmotion.support.worker_processes import Fault as Fault
from calmotion.support.worker_processes import results_of as results_of
